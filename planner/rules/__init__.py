"""The judgement: one module per rule family, each a function from the prediction to findings."""

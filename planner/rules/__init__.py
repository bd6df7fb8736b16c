"""The rules that judge a predicted flight: each with its text and its function, by subject."""

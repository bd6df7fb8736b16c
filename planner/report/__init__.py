"""Results as text and data; ``planner.quantity`` alone writes numbers."""

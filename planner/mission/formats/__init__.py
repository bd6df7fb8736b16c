"""Mission files: what is read and written."""

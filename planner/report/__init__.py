"""Results as text and data; ``numbers`` is the only place where a quantity becomes text."""

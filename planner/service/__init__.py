"""The use cases, called alike by the command line, the terminal UI and scripts."""

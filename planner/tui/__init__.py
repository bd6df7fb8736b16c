"""The terminal UI: review a mission as a pilot would, anywhere a terminal runs.

What a pane shows is worked out by pure modules (rows, details, curves, ground, what_if, …); widgets
draw it and speak in messages; only screens ask the service.
"""

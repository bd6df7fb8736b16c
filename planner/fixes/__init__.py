"""What turns a no-go into a go, and shows what a change is worth."""

"""What talks to the user on a terminal: questions, progress, a job under way, and errors in words."""

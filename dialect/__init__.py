"""How a program is written: its text, its words, its numbers. Knows no machine and no geometry."""

"""A text program becomes a print: protocol, sender, journal, emulator. Knows no geometry: it sends lines."""

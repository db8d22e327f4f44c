"""Where pyserial finds our own URL schemes, once this package stands in its list of handler packages."""

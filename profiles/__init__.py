"""What a machine is: the schema of a profile and one TOML file per shipped machine."""

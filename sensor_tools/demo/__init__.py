"""The demonstration: simulated sensors and their drivers, recorded and compared with the truth."""

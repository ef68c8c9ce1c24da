"""Tools around the drivers: simulators and the demonstration."""

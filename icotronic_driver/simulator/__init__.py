"""A simulated ICOtronic system: the device side of the protocol, without I/O, and a bus for it."""

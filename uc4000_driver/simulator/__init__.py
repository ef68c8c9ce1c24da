"""Simulated UC4000 sensors: the device side of the protocol, without I/O, and a wire for it."""

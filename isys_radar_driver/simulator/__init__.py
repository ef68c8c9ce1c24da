"""Simulated iSYS radars: the device side of the protocol, without I/O, and a line for it."""

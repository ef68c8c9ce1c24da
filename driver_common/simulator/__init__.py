"""Transports of simulated devices: a serial line, a CAN bus."""

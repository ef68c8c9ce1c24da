"""Looking for sensors, read-only: who answers on a serial port or a CAN bus, and what is wrong."""

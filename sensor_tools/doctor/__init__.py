"""Finding out what is wrong with a port, a bus or the middleware; read-only."""

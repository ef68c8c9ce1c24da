"""What the three drivers share: settings, links, the device thread and the lifecycle node."""

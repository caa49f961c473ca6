"""The ground: what every other room stands on."""

"""The laboratory: worlds measured against what is known on paper."""

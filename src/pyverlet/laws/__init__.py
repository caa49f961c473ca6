"""What particles follow: one small class an idea."""

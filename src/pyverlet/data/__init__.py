"""Worlds as files. Importing this loads nothing but the engine; libraries that write a format are loaded when it is asked for."""

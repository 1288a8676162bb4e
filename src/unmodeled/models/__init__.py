"""Force models: ``physics`` is what the equations know, ``learned`` is what the data taught."""

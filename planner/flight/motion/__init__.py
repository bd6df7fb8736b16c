"""How a vehicle moves along its route, one module per way of flying."""

"""A swarm simulated: agents that move by their models, and a policy that keeps them apart."""

"""Several missions flown at the same time in one airspace."""

from planner.fleet.swarm.algorithms import Algorithm as Algorithm
from planner.fleet.swarm.policies import Policy as Policy

"""Several missions flown at the same time in one airspace."""

from planner.fleet.swarm.algorithms import Algorithm as Algorithm
from planner.fleet.swarm.policies import Policy as Policy
from planner.fleet.swarm.situation import SwarmSituation as SwarmSituation

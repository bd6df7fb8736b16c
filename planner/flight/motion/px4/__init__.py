"""How PX4 flies a multicopter mission: the laws of its trajectory generation, in closed form.

PX4 moves a point along the mission and lets the vehicle follow it: `pilot` holds parameters, wind, noise and
drag of a vehicle, and makes a motion of the stages of a route in five steps, each of all flights at once.

1. `moves`: what the navigator makes of the stages, a row for each place that is flown to.
2. `legs`: moves planned between their waypoints (corner speeds here, waits in `headings`), then flown after
   what those before hand on to them: a turn (`turns`; `joins` of legs that need none), and a straight.
3. `straights`: one profile along a line: rise, cruise, braking; what axes allow limits it (`braking` has the
   formulas).  `landing` has take-offs, landings, and how vehicles settle on a place.
4. `leg_profile`: the same as `pieces`, cubics of time and what is added to them (`laws`), in flown order.
5. `lag`: how far drag lets the vehicle fall behind, and what the point waits for it.  As a waypoint counts as
   reached by the place of the vehicle, 2 to 4 are done once without the lag before.

Sources are named by file and function of PX4's 1.17 line; "measured" means autopilots flown in simulation.
"""

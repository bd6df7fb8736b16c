"""Pure functions of physics: responses, atmosphere, wind, rotor, battery.  No I/O, no state."""

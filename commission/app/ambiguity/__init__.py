"""Where a vehicle that is switched on could take its place for another one."""

"""What a site still lacks on its way from nothing to a driving vehicle, step by step, and where it is supplied."""

"""What a site promises before a vehicle drives in it: visibility, dilution, prediction, suggested layouts."""

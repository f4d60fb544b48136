"""What every feature stands on: state, actions, jobs, widgets, layers, cameras, the server. It knows no feature."""

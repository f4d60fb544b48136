"""The floor map: loaded, drawn on, aligned, and shown in the plan and in 3D."""

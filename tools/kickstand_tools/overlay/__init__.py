"""A ride's lean, forces and speed drawn over a video of it, or as a clip to lay over one."""

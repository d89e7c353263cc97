"""What one participant meets: slot, plan, steps and progress."""

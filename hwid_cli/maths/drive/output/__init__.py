"""What the sensor of the output makes of the displacement."""

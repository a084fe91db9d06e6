"""Trade-offs: fronts of optimal gaits between two or more quantities, such as cost and peak torque."""

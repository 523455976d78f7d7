"""What is probably typed wrong in a model file: units, digits, teeth, supports.

`rules` is the table of all rules; what no drivetrain can be is refused when a file is loaded
(`tooth_numbers.refuse_impossible`), the rest is pointed out by ``crosscheck check``.
"""

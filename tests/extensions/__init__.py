"""Extensions written outside the package, each in one file, as a user would write them."""

"""Break the package one spot at a time and see which tests notice; see ``__main__``."""

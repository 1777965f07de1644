"""What decides: controllers, one file each, as `Model`s like any component."""

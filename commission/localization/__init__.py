"""The estimators: pure steps over arrays and the one mutable `Localizer`. No clock, no file, no random source."""

//! Views → calibration with stated uncertainty.

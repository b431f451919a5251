//! The co-simulation master: reads an SSP system description, couples FMI 2.0 units, records the run.

//! The FMI 2.0 exports of this library's models: what an FMU loads.

terramech_fmi2::export!(testunits::models);

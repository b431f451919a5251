//! What a run leaves on disk: manifest, summary, CSV, log, VTK, report.

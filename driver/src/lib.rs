//! The pipelines: sources to outputs, reports and proofs

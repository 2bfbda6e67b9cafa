//! Readers and writers of the chart languages

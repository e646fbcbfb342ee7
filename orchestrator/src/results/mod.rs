//! What a run leaves behind, as plain records and as files.

//! Scan files and poses: the only library of Congruent that opens files.

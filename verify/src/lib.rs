//! What is proved of a net, and the equivalence of logic with a net

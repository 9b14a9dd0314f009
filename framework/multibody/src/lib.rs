//! The structure of a mechanism: bodies, hinges made of subhinges, nodes.

"""MAVLink as both sides of a link need it: addresses, links, frames, geodetic origin."""

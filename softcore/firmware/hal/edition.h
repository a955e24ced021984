/* Generated from softcore/regmap.py and softcore/linkmap.py by `python -m softcore.generate`; do not edit. */
#define GATEWARE_EDITION 0xbdbb57e6

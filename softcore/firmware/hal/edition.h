/* Generated from regmap.py, flashmap.py, linkmap.py, scopemap.py and tables/ in softcore by `python -m softcore.generate`; do not edit. */
#define GATEWARE_EDITION 0x718552f9

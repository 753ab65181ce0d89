"""Draw tables with objects, and what depth cameras measure of them, to train and to test segmentation."""

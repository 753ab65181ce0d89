"""Train the segmentation network: objects, scenes and views made on the fly, the network, its loss, and the loop."""

"""From trained networks to agent bundles: ONNX files and cards."""

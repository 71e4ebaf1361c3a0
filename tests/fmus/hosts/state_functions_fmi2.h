/* The functions of FMI 2.0 for states; included with FUNCTION(name) defined. */
FUNCTION(GetFMUstate)
FUNCTION(SetFMUstate)
FUNCTION(FreeFMUstate)
FUNCTION(SerializedFMUstateSize)
FUNCTION(SerializeFMUstate)
FUNCTION(DeSerializeFMUstate)

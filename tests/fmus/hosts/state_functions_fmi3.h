/* The functions of FMI 3.0 for states; included with FUNCTION(name) defined. */
FUNCTION(GetFMUState)
FUNCTION(SetFMUState)
FUNCTION(FreeFMUState)
FUNCTION(SerializedFMUStateSize)
FUNCTION(SerializeFMUState)
FUNCTION(DeserializeFMUState)

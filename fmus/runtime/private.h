/* PRIVATE marks what no other file of a program can see. The runtime is compiled as one file, `all.c`, so everything but the
   functions of FMI is private: two FMUs can be linked into one program. A test that compiles one file alone defines it empty. */
#ifndef PRIVATE
#define PRIVATE static
#endif

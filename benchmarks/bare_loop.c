/* Forward kinematics of many poses, one after another: the arithmetic of er3a/kinematics/forward.py and fast_math.py,
   right angles between axes multiplied in full. */
#include <stddef.h>
#include <math.h>
static inline void cs(double angle, double *co, double *si){
  double k = floor(angle*0.63661977236758134308+0.5);
  double x = (angle-k*1.57079632673412561417e+00)-k*6.07710050650619224932e-11, z=x*x;
  double s=2.75573137070700676789e-06+z*(-2.50507602534068634195e-08+z*1.58969099521155010221e-10);
  s=8.33333333332248946124e-03+z*(-1.98412698298579493134e-04+z*s);
  s=x+x*z*(-1.66666666666666324348e-01+z*s);
  double c=-2.75573143513906633035e-07+z*(2.08757232129817482790e-09+z*-1.13596475577881948265e-11);
  c=-1.38888888888741095749e-03+z*(2.48015872894767294178e-05+z*c);
  c=z*(4.16666666666666019037e-02+z*c);
  double half=0.5*z, one=1.0-half; c=one+((1.0-one)-half+z*c);
  double q4=k-4.0*floor(0.25*k); int odd=(q4==1.0)|(q4==3.0);
  double a=odd?s:c,b=odd?c:s; *co=((q4==1.0)|(q4==2.0))?-a:a; *si=(q4>=2.0)?-b:b;
}
void forward(size_t n,const double*restrict q,const double*restrict dir,const double*restrict off,const double*restrict links,double*restrict out){
  for(size_t i=0;i<n;i++){
    double T[12]; for(int j=0;j<12;j++) T[j]=links[j];
    for(int k=0;k<6;k++){
      double c,s; cs(dir[k]*q[6*i+k]+off[k],&c,&s); const double*L=links+16*(k+1);
      for(int r=0;r<3;r++){
        double p=T[4*r]*c+T[4*r+1]*s, u=T[4*r+1]*c-T[4*r]*s, t=T[4*r+2];
        T[4*r]=p*L[0]+u*L[4]+t*L[8]; T[4*r+1]=p*L[1]+u*L[5]+t*L[9]; T[4*r+2]=p*L[2]+u*L[6]+t*L[10]; T[4*r+3]+=p*L[3]+u*L[7]+t*L[11];
      }}
    double*o=out+16*i; for(int j=0;j<12;j++) o[j]=T[j]; o[12]=o[13]=o[14]=0; o[15]=1;
  }
}

/* The same over blocks of poses, one number of all poses in a row, so that each inner loop becomes vector instructions. */
enum { B = 64 };
void forward_blocks(size_t n,const double*restrict q,const double*restrict dir,const double*restrict off,const double*restrict links,double*restrict out){
  double T[12][B], co[B], si[B];
  for(size_t start=0;start<n;start+=B){
    size_t size = n-start<B ? n-start : B;
    for(int j=0;j<12;j++) for(int i=0;i<B;i++) T[j][i]=links[j];
    for(int k=0;k<6;k++){
      for(size_t i=0;i<B;i++) co[i]=dir[k]*q[6*(start+(i<size?i:size-1))+k]+off[k];
      for(int i=0;i<B;i++){ double c,s; cs(co[i],&c,&s); co[i]=c; si[i]=s; }
      const double*L=links+16*(k+1);
      for(int r=0;r<3;r++){
        double*restrict x=T[4*r],*restrict y=T[4*r+1],*restrict z=T[4*r+2],*restrict w=T[4*r+3];
        for(int i=0;i<B;i++){
          double p=x[i]*co[i]+y[i]*si[i], u=y[i]*co[i]-x[i]*si[i], t=z[i];
          x[i]=p*L[0]+u*L[4]+t*L[8]; y[i]=p*L[1]+u*L[5]+t*L[9]; z[i]=p*L[2]+u*L[6]+t*L[10]; w[i]+=p*L[3]+u*L[7]+t*L[11];
        }}}
    for(size_t i=0;i<size;i++){
      double*o=out+16*(start+i); for(int j=0;j<12;j++) o[j]=T[j][i]; o[12]=o[13]=o[14]=0; o[15]=1;
    }
  }
}
